"""One kit for pages: palette, numbers, tables, charts, figures, HTML and Markdown pages."""
