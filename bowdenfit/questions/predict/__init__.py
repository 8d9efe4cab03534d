"""What will the cable do at lengths or wrap angles?"""
