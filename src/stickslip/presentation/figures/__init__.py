"""The figures of results; each is one `Plot`, drawn by plotly on a page or by matplotlib."""
