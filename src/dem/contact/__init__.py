"""Contact laws, the list of those in use, and the block loop that evaluates them."""
