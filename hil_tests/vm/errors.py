"""The one error of this package: what is missing, and what to do about it."""


class Unavailable(Exception):
    """The machine or the interface cannot be had; the message is one paragraph that ends with a remedy."""
