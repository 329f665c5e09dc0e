"""
Messages on their way into a bag, and to the session.

`topics.recorded_topics` says which, `recorder.Recorder` writes them, and
`message_dispatcher.MessageDispatcher` tells the session what they say. When a bag begins and ends
the session decides.
"""
