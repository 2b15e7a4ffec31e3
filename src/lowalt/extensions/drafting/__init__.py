"""Drafting: from a mesh or a robot's description to a draft of a record (`lowalt target new`)."""
