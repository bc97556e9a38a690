"""`zoobench stability`: hard cases, each judged on its physics, and the largest stable step of many scenes."""
