"""Pictures and words of the app as pure functions: values, columns and rows in, text out."""
