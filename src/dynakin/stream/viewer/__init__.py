"""The live viewer: a process of its own that shows the newest estimate."""
