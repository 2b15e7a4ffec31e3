"""Files for other tools: ONNX, SigMF, data sets on web servers, and the zoo of small models."""
