"""Files of other tools: export writes them, bring (the command `import`) reads them."""
