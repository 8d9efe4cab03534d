"""What people read: the printed summary."""
