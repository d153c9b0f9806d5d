"""Pages that stand alone: html and page, figures/, one file per page; style is shared."""
