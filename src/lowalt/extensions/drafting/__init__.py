"""Drafting: from a user's mesh or robot description to the draft of a record (`lowalt target new`)."""
