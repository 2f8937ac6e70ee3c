"""Systems that stand around a plant."""
