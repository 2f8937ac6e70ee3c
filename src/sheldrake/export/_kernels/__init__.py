"""What a frozen diagram needs beside the event loop."""
