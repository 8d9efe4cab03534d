"""What is worth measuring next?"""
