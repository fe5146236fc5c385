"""What stands before the routes: whom the service answers, how much it takes from one, and how long it waits."""
