"""What a finished simulation is worth as a measurement: the heap's angle and height, the sheared soil's strength."""
