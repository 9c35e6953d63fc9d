"""Force plates: centre of pressure, loads that are not the person's, and what no foot does to a plate."""
