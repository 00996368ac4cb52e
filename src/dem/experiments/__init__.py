"""Virtual geotechnical tests, built on the public API of `dem` only."""
