"""Files and their errors: whole or not there, one sentence for what is wrong in them. No stage is known here."""
