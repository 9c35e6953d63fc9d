"""Sections of the report's page: words, tables and panels."""
