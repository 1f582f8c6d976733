"""What a person runs: studies, campaigns, their store and reports, and the command line."""
