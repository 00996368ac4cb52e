"""Who can touch whom: cell grid, outer lists, and the contact blocks pruned from them."""
