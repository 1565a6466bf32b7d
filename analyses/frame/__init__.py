"""What all long questions share: a results folder, finished jobs, and who follows the work."""
