"""Pictures, reports, movies and the live page."""
