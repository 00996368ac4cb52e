"""What the engine must reproduce: published and closed-form results, each a case that runs through the public API of `dem`."""

from verification.check import Check

__all__ = ["Check"]
