"""Rows that keep coming: sums over rows that consequents are solved from, and their addition."""
