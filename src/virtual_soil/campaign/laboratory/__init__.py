"""Readers of laboratory files: `rows` splits a file into cells, `table` finds the readings, `entry` reads a soil file's entry."""
