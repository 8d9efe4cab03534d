"""What would a bench read, were the truth known?"""
