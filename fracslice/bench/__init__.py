"""Run time against error, ours and other programs', measured on the user's own machine."""
