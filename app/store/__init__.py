"""The laboratory's memory: the database's tables, its queries, and the record files."""
