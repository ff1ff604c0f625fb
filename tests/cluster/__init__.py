"""Jobs on several processes: the same bytes as on one machine, whatever workers come, go or die."""
