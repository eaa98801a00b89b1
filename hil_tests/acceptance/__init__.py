"""The acceptance tests, grouped by what they judge; run them with pytest."""
