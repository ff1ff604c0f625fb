"""Jobs: from a scene to a finished file, stage after stage."""
