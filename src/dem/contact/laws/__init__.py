"""Contact laws, one module each."""
