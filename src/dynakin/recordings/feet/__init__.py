"""When each foot stands, and which plate bears it."""
