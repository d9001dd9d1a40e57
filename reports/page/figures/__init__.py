"""The figures of the page, one file a subject: matplotlib drawings as inline SVG."""
