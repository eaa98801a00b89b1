"""The one error of this package: what is missing, and what to do about it."""


class Unavailable(Exception):
    """There is no machine or no interface; the message is a paragraph that ends with a remedy."""
