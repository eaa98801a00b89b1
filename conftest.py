"""A run from the checkout loads the plugin under the very name of its entry point."""

pytest_plugins = ["hil_tests.plugin"]
