"""What a run leaves behind: its folder, results, traces and what people read."""
