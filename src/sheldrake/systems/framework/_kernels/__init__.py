"""The event loop, interpreted or compiled: the one function that advances a context from event to event."""
