"""A run of the suite under pytest: options, selection, bench, outcomes, terminal.

The plugin holds the hooks; what they do is here. Nothing heavy is imported before a test
of ours is collected, because pytest loads the plugin in every project of the machine.
"""
