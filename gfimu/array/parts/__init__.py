"""Parts: what the data sheets of chips state, and what a channel of them can read."""
