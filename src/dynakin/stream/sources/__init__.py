"""Where live samples come from: capture systems, replayed recordings, a simulated person."""
