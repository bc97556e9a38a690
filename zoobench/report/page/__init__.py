"""The report for a browser: one page with leaderboards, charts, pictures, failures and provenance."""
