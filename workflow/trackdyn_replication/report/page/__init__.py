"""The report: one page that carries its data, pictures and scripts with it."""
