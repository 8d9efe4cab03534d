"""What does a hand feel of a remote wall through a cable, and which walls does it touch without bouncing?"""
