"""Files of pictures and layers, printers' resins, and uploads."""
