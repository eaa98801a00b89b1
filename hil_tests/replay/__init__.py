"""The third bench: recordings go through the same tests, or are judged by what needs no test."""
