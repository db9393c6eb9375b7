"""What `./hive test` does around pytest: the second look, the closing lines, and a clean end."""
