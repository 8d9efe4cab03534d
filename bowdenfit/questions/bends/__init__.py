"""What do stretch, preload and loops do at a wrap angle?"""
