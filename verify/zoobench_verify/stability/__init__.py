"""`zoobench verify stability`: extreme cases judged by their physics, and the largest stable step of many scenes."""
