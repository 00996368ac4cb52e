"""Contact laws, one file each, and the block kernel that joins them."""
