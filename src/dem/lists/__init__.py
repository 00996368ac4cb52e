"""Candidates for contact: cell grid, outer lists, and the contact blocks pruned from them."""
