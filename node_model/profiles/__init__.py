"""Device profiles that ship as data."""
