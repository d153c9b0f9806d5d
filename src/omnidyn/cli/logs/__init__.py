"""What is done with a log as a file: info (what it holds), convert (the same in another format)."""
