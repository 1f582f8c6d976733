"""Pages in the browser: what runs tell of themselves while they work, and a page to start them from."""
