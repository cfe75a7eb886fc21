"""Pictures, films and plots of run folders; never touches a live solver."""
