"""Programs with Python in the loop, as people write them, for Drake and for us (`tools/compare_speed.py`)."""
