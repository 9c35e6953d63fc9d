"""Where live estimates go: streams, the recorder."""
