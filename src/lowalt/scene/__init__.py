"""What a station receives of a target in a scene.

signal = detect(receive(transmit(sum of responses))).
"""
