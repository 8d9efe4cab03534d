"""What a user of the library might add, one of each: nothing here is part of bowdenfit, and nothing in bowdenfit knows it."""
