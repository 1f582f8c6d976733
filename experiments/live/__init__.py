"""Pages in the browser: a page that watches a run, and a page to start runs."""
