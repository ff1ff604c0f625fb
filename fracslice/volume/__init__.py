"""From a field to sparse samples around its surface, and to OpenVDB."""
